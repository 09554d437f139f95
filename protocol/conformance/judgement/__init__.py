"""What a table should do, and the verdict on what it did."""

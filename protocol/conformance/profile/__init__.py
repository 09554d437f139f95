"""What is known of a table under test, and what the specification says."""

"""One session with a table: first contact, then the cases in turn."""

"""What a session has seen: record, report, and the replay of a record."""

"""Results of a session: record, report, and the replay of a record."""

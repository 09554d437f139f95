"""The properties of a table under test, and the clauses of the specification."""

"""A plan on the table: streamed, watched, corrected, verified and recorded."""

"""The page of a run, the table of errors, and the style that all figures share."""

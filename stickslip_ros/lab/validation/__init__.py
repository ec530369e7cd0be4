"""The contact mechanics against what is known: closed forms, springs, a 3-D solution, tables."""

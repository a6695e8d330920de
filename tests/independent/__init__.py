"""Independent solutions that the tests compare results with; `walls` and `traces` import nothing of hertzlink."""

"""Independent solutions that tests compare results with; `walls`, `traces`, `thesis` import nothing of hertzlink."""

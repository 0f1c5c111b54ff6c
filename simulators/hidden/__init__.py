"""Units with effects hidden from the diagnosis: test cases with known truths."""

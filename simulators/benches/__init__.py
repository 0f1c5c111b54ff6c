"""What loads a simulated unit: a testing machine, or a foot in a worn shoe."""

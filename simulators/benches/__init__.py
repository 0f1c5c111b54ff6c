"""Who loads a plant: a testing machine, a worn shoe."""

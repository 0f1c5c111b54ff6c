"""A shoe on a serial port: the port, its reader thread, what comes as blocks and events; `shoe.SerialShoe`."""

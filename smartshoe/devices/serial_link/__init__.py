"""A shoe on a serial port: the port, its reader thread, and the blocks and events it produces.

See `shoe.SerialShoe`.
"""

"""`doctor`: finds out why there is no status, and names the next action.

`listen` runs the gateway on a connection, `collector` collects the input, `probes` examines a silent connection on this
computer. The result is a value, `findings`. The table in `diagnosis` maps it to a fault.
"""

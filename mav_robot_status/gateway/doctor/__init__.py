"""`doctor`: why is there no status? What was found on a connection, and the one next action.

`listen` lets the gateway listen, `collector` takes down what comes in, `probes` asks this computer about a silent
connection. All that becomes `findings`, a value, which `diagnosis` judges by a table.
"""

"""Statuses over MQTT: one connection for each robot, events that wait on disk, and the board that reads them all.

From the top: `publisher` hands over to `courier`, a thread of its own, which has a `robot` for each name and the
`spool`; `journal` keeps what is on its way there; `connection` and `loop` turn paho's clients, `client` makes them,
`complaints` says what is wrong; `fleet` is the other end. docs/mqtt.md: what is on the topics.
"""

"""Statuses over MQTT: one connection for each robot, undelivered events on disk, and the fleet page that reads them.

`publisher` hands messages to `worker`, which has its own thread, a `robot` for each name, and the `spool`. `journal`
holds an event until the spool has it. `connection` and `loop` run the clients of paho, `client` makes them, and
`reasons` has words for their errors. `fleet` reads the published topics. docs/reference/mqtt.md describes the topics.
"""

"""Statuses for ROS, without an installation of ROS.

ROS 2: `publisher` hands messages to `worker`, which has its own thread and a `transport`: `zenoh` (for rmw_zenoh) or
`dds`. `messages` and `diagnostics` are what is published, `cdr` encodes it, `naming` gives each handle a topic.
"""

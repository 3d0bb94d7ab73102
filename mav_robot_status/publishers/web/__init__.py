"""The live board in a browser: a page, its event stream and a JSON API. All of it is read-only.

`serve` depends on a board only, not on the gateway. The gateway uses `publisher`.
"""

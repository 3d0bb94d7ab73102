"""The live board in a browser: a page, its event stream, and a JSON API. For reading only.

`serve` needs a board and nothing else of this package's gateway; `publisher` is what the gateway uses.
"""

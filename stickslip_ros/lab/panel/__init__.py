"""The front panel: a page in the browser, and a server on this host that feeds it."""

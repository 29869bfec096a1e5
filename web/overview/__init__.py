"""Page with the state of all instruments of one computer: `pneuforce overview`."""

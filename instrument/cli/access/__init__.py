"""Commands for certificates, signatures and the users of the web page."""

"""Login on the web page: users, passwords, sessions, rate limits."""

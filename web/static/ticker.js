// Worker that sends a message twice per second. Its timer also runs while the page is hidden.

setInterval(() => postMessage("tick"), 500);

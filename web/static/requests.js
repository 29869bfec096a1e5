// HTTP requests to the web server.

const TIMEOUT_MS = 3000;

/**
 * Send a POST request. Return the HTTP status and the JSON answer, or status 0 and an error text.
 *
 * A successful answer whose body does not arrive or is not JSON counts as no answer.
 */
export async function post(path, body, timeout_ms = TIMEOUT_MS) {
  try {
    const response = await fetch(path, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(body),
      signal: AbortSignal.timeout(timeout_ms),
    });
    const text = await response.text();
    return { status: response.status, answer: response.ok ? JSON.parse(text) : parsedOrEmpty(text) };
  } catch {
    return {
      status: 0,
      answer: { text: "No answer: the request was possibly executed. Check the state." },
    };
  }
}

/** Return the JSON of an error answer; {} if another server has answered in another format. */
function parsedOrEmpty(text) {
  try {
    return JSON.parse(text);
  } catch {
    return {};
  }
}

/** Return the JSON of a GET request. Throws an error if the request fails. */
export async function get(path, timeout_ms = TIMEOUT_MS) {
  const response = await fetch(path, { signal: AbortSignal.timeout(timeout_ms) });
  if (!response.ok) throw new Error(String(response.status));
  return response.json();
}

/** Facts about an instrument that has not been reached yet. */
export const UNKNOWN_INFO = {
  registers: [],
  faults: {},
  status: {},
  reject_reasons: {},
  states: {},
  maintenance: {},
};

// Questions to the page's own server.

const PATIENCE_MS = 3000;

/** What became of a request: the HTTP status and the answer; status 0 with a sentence where there was none. */
export async function post(path, body) {
  try {
    const response = await fetch(path, {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify(body),
      signal: AbortSignal.timeout(PATIENCE_MS),
    });
    return { status: response.status, answer: await response.json().catch(() => ({})) };
  } catch {
    return { status: 0, answer: { text: "No answer: it is not known whether the instrument was asked." } };
  }
}

/** What is to be looked at there. Raises where there is no answer. */
export async function get(path) {
  const response = await fetch(path, { signal: AbortSignal.timeout(PATIENCE_MS) });
  if (!response.ok) throw new Error(String(response.status));
  return response.json();
}

/** What is known of an instrument before it has said anything. */
export const UNKNOWN = { registers: [], faults: {}, status: {}, refusals: {}, states: {} };

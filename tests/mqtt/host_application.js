// Host application of Sparkplug B. Output: one line of JSON for each received message.
// Input: one line of JSON for each message to publish, with `metrics`, with the bytes `hex`, or with a `text`.
const { createInterface } = require("readline");
const mqtt = require("mqtt");
const sparkplug = require("sparkplug-payload").get("spBv1.0");

const plain = (value) => (value && typeof value.toNumber === "function" ? value.toNumber() : value ?? null);

const metricOf = (metric) => ({
  name: metric.name,
  type: metric.type,
  value: plain(metric.value),
  historical: metric.isHistorical ?? false,
  utc_ms: plain(metric.timestamp),
  properties: Object.keys(metric.properties ?? {}),
});

const client = mqtt.connect(`mqtt://127.0.0.1:${process.argv[2]}`, { reconnectPeriod: 100 });
client.on("connect", () => client.subscribe("spBv1.0/#", () => console.log(JSON.stringify({ kind: "connected" }))));
client.on("error", () => {});
client.on("message", (topic, bytes) => {
  const [, group, kind, node] = topic.split("/");
  if (group === "STATE") return;
  const { timestamp, seq, metrics } = kind.endsWith("CMD") ? {} : sparkplug.decodePayload(bytes);
  const message = { kind, node, topic, utc_ms: plain(timestamp), seq: plain(seq), metrics: (metrics ?? []).map(metricOf) };
  console.log(JSON.stringify(message));
});

createInterface({ input: process.stdin }).on("line", (line) => {
  const { topic, metrics, hex, text, retain } = JSON.parse(line);
  const bytes = metrics ? sparkplug.encodePayload({ timestamp: Date.now(), metrics }) : Buffer.from(hex ?? text, hex === undefined ? "utf8" : "hex");
  client.publish(topic, bytes, { retain: retain ?? false, qos: 1 });
});

// A viewer of the Foxglove protocol: the client of @foxglove/ws-protocol, and the decoder of messages that Foxglove and Lichtblick use. It
// reads orders as lines of JSON, and prints events as lines of JSON.
//
//     node foxglove_viewer.cjs URL [PROTOCOL [ORIGIN]]
'use strict';

const path = require('node:path');
const readline = require('node:readline');
const { createRequire } = require('node:module');

const installed = createRequire(path.join(process.env.BENCH_DRAGON_NODE, 'package.json'));
const WebSocket = installed('ws');
const { FoxgloveClient } = installed('@foxglove/ws-protocol');
const { parse } = installed('@foxglove/rosmsg');
const { MessageReader } = installed('@foxglove/rosmsg2-serialization');

const [url, protocol, origin] = process.argv.slice(2);
const socket = new WebSocket(url, [protocol ?? FoxgloveClient.SUPPORTED_SUBPROTOCOL], { origin });
const client = new FoxgloveClient({ ws: socket });

const channels = new Map();
const services = new Map();
const subscribed = new Map();

function print(event, values) {
  const plain = (_, value) => {
    if (typeof value === 'bigint') return Number(value);
    return ArrayBuffer.isView(value) ? Array.from(value) : value;
  };
  console.log(JSON.stringify({ event, ...values }, plain));
}

// Decodes a message by the schema that the server has sent.
function decode({ encoding, schemaEncoding, schema }, data) {
  if (encoding === 'json' && schemaEncoding === 'jsonschema') {
    JSON.parse(schema);
    return JSON.parse(Buffer.from(data.buffer, data.byteOffset, data.byteLength).toString());
  }
  if (encoding !== 'cdr' || schemaEncoding !== 'ros2msg') throw new Error(`${encoding} ${schemaEncoding}`);
  return new MessageReader(parse(schema, { ros2: true })).readMessage(data);
}

client.on('open', () => print('open', { protocol: socket.protocol }));
client.on('error', (error) => print('error', { message: String(error) }));
client.on('close', ({ code, reason }) => print('close', { code, reason }));
client.on('serverInfo', (info) => print('serverInfo', info));
client.on('status', ({ level, message }) => print('status', { level, message }));
client.on('time', ({ timestamp }) => print('time', { ns: String(timestamp) }));
client.on('advertise', (advertised) => {
  advertised.forEach((channel) => channels.set(channel.topic, channel));
  print('advertise', { topics: advertised.map(({ topic }) => topic), schemas: advertised.map(({ schemaName }) => schemaName) });
});
client.on('unadvertise', (ids) => {
  const gone = [...channels.values()].filter(({ id }) => ids.includes(id)).map(({ topic }) => topic);
  gone.forEach((topic) => channels.delete(topic));
  print('unadvertise', { topics: gone });
});
client.on('advertiseServices', (advertised) => {
  advertised.forEach((service) => {
    JSON.parse(service.request.schema);
    services.set(service.name, service.id);
  });
  print('services', { names: advertised.map(({ name }) => name) });
});
client.on('parameterValues', ({ parameters, id }) => print('parameters', { parameters, id }));
client.on('serviceCallResponse', ({ callId, data }) => print('response', { callId, reply: JSON.parse(Buffer.from(data).toString()) }));
client.on('serviceCallFailure', ({ callId, message }) => print('failure', { callId, message }));
client.on('message', ({ subscriptionId, timestamp, data }) => {
  const { channel, decodes } = subscribed.get(subscriptionId);
  const bytes = Buffer.from(data.buffer, data.byteOffset, data.byteLength);
  const content = decodes ? { message: decode(channel, data) } : { hex: bytes.toString('hex') };
  print('message', { topic: channel.topic, ns: String(timestamp), ...content });
});

const ORDERS = {
  // A topic, and whether its messages are decoded.
  subscribe(topic, decodes) {
    const channel = channels.get(topic);
    subscribed.set(client.subscribe(channel.id), { channel, decodes });
  },
  unsubscribe(topic) {
    const [id] = [...subscribed].find(([, { channel }]) => channel.topic === topic);
    client.unsubscribe(id);
  },
  parameters: (names, id) => client.getParameters(names, id),
  follow: (names) => client.subscribeParameterUpdates(names),
  set: (name, value, id) => client.setParameters([{ name, value }], id),
  call(name, callId, request) {
    const data = new TextEncoder().encode(JSON.stringify(request));
    client.sendServiceCallRequest({ serviceId: services.get(name) ?? name, callId, encoding: 'json', data });
  },
  text: (text) => socket.send(text),
  binary: (hex) => socket.send(Buffer.from(hex, 'hex')),
  // Bytes as they are, without a frame.
  raw: (hex) => socket._socket.write(Buffer.from(hex, 'hex')),
  // Stops and resumes reading from the socket, so that pings are not answered.
  pause: () => socket.pause(),
  resume: () => socket.resume(),
  close: () => client.close(),
};

const orders = readline.createInterface({ input: process.stdin });
orders.on('line', (line) => {
  const [order, ...values] = JSON.parse(line);
  ORDERS[order](...values);
});
orders.on('close', () => process.exit(0));

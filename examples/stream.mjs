// Prints the head's front hinge, frame by frame, until the run ends: stream.mjs [ADDRESS [TOKEN]]
// Node 22 has WebSocket; before, run `npm install ws` first.

const [address = '127.0.0.1:8223', token] = process.argv.slice(2);
const Socket = globalThis.WebSocket ?? (await import('ws')).WebSocket;
const shown = token === undefined ? [] : [`bench-dragon.token.${token}`];
const socket = new Socket(`ws://${address}/stream`, ['bench-dragon.json.v1', ...shown]);
socket.onmessage = ({ data }) => {
  const message = JSON.parse(data); // frame, run, plan, alert, command, status or outcome
  if (message.type !== 'frame') return;
  const [x, y] = message.positions_m[0]; // N + 1 handles: x, y and z in metres
  console.log(`${message.time_s.toFixed(3)} s: front hinge ${x.toFixed(3)}, ${y.toFixed(3)} m`);
  if (message.state === 'ended') socket.close();
};
socket.onerror = ({ message }) => console.error(`no stream from ${address}: ${message}: run \`bench-dragon view\``);

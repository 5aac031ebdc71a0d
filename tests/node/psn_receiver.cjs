// Receives PosiStageNet with @jwetzell/posistagenet, from a socket that has joined the multicast group: see psn_receivers.py.
//
//     node psn_receiver.cjs SOCKET FRAMES FILE
'use strict';

const dgram = require('node:dgram');
const fs = require('node:fs');
const { createRequire } = require('node:module');
const path = require('node:path');

const installed = createRequire(path.join(process.env.BENCH_DRAGON_NODE, 'package.json'));
const { Decoder, Decoders } = installed('@jwetzell/posistagenet');

const DATA_PACKET = 0x6755;
const [fd, frames, file] = [Number(process.argv[2]), Number(process.argv[3]), process.argv[4]];
const datagrams = [];
let left = null;

const socket = dgram.createSocket('udp4');
socket.on('message', (datagram) => {
  datagrams.push(datagram);
  if (datagram.readUInt16LE(0) === DATA_PACKET) {
    left ??= frames * Decoders.DataPacketChunk(datagram).data.packetHeader.data.framePacketCount;
    left -= 1;
    if (left === 0) {
      socket.close();
      write();
    }
  }
});
socket.bind({ fd });

function vector(chunk) {
  return [chunk.data.x, chunk.data.y, chunk.data.z];
}

function trackerRow({ chunk, data }) {
  const status = data.status.data.validity;
  return [chunk.header.id, ...vector(data.pos), ...vector(data.speed), ...vector(data.ori), status, Number(data.timestamp.data.timestamp)];
}

// Groups consecutive packets of one frame id.
function framesOf(packets) {
  const found = [];
  for (const { data } of packets) {
    const header = data.packetHeader.data;
    if (found.length === 0 || found.at(-1).frame_id !== header.frameId) {
      found.push({ frame_id: header.frameId, headers: [], trackers: [] });
    }
    found.at(-1).headers.push([Number(header.packetTimestamp), header.versionHigh, header.versionLow, header.framePacketCount]);
    found.at(-1).trackers.push(...data.trackerList.data.trackers.map(trackerRow));
  }
  return found;
}

// The decoder assembles frames itself, except those with the id 0.
function namesOf() {
  const decoder = new Decoder();
  datagrams.forEach((datagram) => decoder.decode(datagram));
  const named = Object.values(decoder.trackers).map((tracker) => [tracker.id, tracker.name]);
  return { system_name: decoder.systemName, names: Object.fromEntries(named) };
}

function write() {
  const data = datagrams.filter((datagram) => datagram.readUInt16LE(0) === DATA_PACKET);
  const lines = framesOf(data.map((datagram) => Decoders.DataPacketChunk(datagram)));
  lines.push({ ...namesOf(), longest: Math.max(...datagrams.map((datagram) => datagram.length)) });
  fs.writeFileSync(file, lines.map((line) => `${JSON.stringify(line)}\n`).join(''));
}

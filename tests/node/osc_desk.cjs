// A desk that steers a show by Open Sound Control, with the package osc of npm. The same orders as tests/python/osc_desk.py.
const path = require("node:path");
const readline = require("node:readline");
const osc = require(path.join(process.env.BENCH_DRAGON_NODE, "node_modules/osc"));

const [remoteAddress, remotePort] = process.argv[2].split(":");

function argument(value) {
    if (typeof value === "string") {
        return { type: "s", value };
    }
    return { type: Number.isInteger(value) ? "i" : "f", value };
}

function packet([address, ...rest]) {
    if (address === "bundle") {
        return { timeTag: osc.timeTag(0), packets: rest.map(packet) };
    }
    return { address, args: rest.map(argument) };
}

const desk = new osc.UDPPort({ localAddress: "127.0.0.1", localPort: 0, remoteAddress, remotePort: Number(remotePort), metadata: false });
desk.on("message", ({ address, args }) => console.log(JSON.stringify([address, ...args])));
desk.on("error", (error) => {
    console.error(error);
    process.exit(1);
});
desk.on("ready", () => {
    console.log(desk.socket.address().port);
    const orders = readline.createInterface({ input: process.stdin });
    orders.on("line", (line) => desk.send(packet(JSON.parse(line))));
    orders.on("close", () => process.exit(0));
});
desk.open();

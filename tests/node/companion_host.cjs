// Bitfocus Companion as far as a module sees it: starts a module, initialises it, watches its feedbacks, and presses its buttons.
//
//     companion_host.cjs FOLDER HOST PORT SECRET
//
// FOLDER is a built module. Each line on stdin is a JSON list of an action and its options. Each line on stdout is a list: "light",
// the feedback and whether it is lit; "variable", its name and value; "status" and its name; "presets" and their actions.
const { fork } = require("node:child_process");
const path = require("node:path");
const readline = require("node:readline");

const [folder, host, port, secret] = process.argv.slice(2);
const manifest = path.join(folder, "companion/manifest.json");
const { runtime } = require(manifest);

const env = { ...process.env, MODULE_MANIFEST: manifest, CONNECTION_ID: "test", VERIFICATION_TOKEN: "token" };
const entrypoint = path.resolve(path.dirname(manifest), runtime.entrypoint);
const child = fork(entrypoint, { env, stdio: ["ignore", "ignore", "inherit", "ipc"] });
let calls = 0;

const print = (...words) => console.log(JSON.stringify(words));
const call = (name, payload) =>
    child.send({ direction: "call", name, payload: JSON.stringify(payload), callbackId: ++calls });
const feedback = (id, feedbackId, options) => [
    id,
    { id, controlId: "button", feedbackId, options, isInverted: false, disabled: false, upgradeIndex: -1 },
];

function initialise() {
    const config = { host, port: Number(port), secret };
    call("init", { label: "dragon", isFirstInit: false, config, secrets: {}, lastUpgradeIndex: -1, feedbacks: {}, actions: {} });
}

/** Watches the feedbacks and presses the buttons of a module that has been initialised. */
function begin() {
    const states = ["ready", "running", "held", "waiting", "paused", "silent"].map((state) => feedback(state, "state", { state }));
    call("updateFeedbacks", { feedbacks: Object.fromEntries([...states, feedback("refused", "refused", {})]) });
    const orders = readline.createInterface({ input: process.stdin });
    orders.on("line", (line) => {
        const [actionId, options] = JSON.parse(line);
        const action = { id: actionId, controlId: "button", actionId, options, disabled: false, upgradeIndex: -1 };
        call("executeAction", { action, surfaceId: "test" });
    });
    orders.on("close", () => child.kill());
}

const heard = {
    register: initialise,
    updateFeedbackValues: ({ values }) => values.forEach(({ id, value }) => print("light", id, value)),
    setVariableValues: ({ newValues }) => newValues.forEach(({ id, value }) => print("variable", id, value)),
    "set-status": ({ status }) => print("status", status),
    setPresetDefinitions: ({ presets }) => print("presets", ...presets.map(({ steps }) => steps[0].down[0].actionId)),
};

child.on("message", ({ direction, name, payload, callbackId, success }) => {
    if (direction === "response" && !success) {
        console.error(payload);
        process.exit(1);
    }
    if (direction === "response" && callbackId === 1) {
        begin();
    }
    if (direction === "call") {
        if (callbackId) {
            child.send({ direction: "response", callbackId, success: true, payload: "{}" });
        }
        heard[name]?.(JSON.parse(payload));
    }
});
child.on("exit", (code) => process.exit(code ?? 0));

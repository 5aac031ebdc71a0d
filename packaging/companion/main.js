// A connection of Bitfocus Companion to `bench-dragon bridge osc --listen`.

const dgram = require('node:dgram')
const { InstanceBase, InstanceStatus, Regex, runEntrypoint } = require('@companion-module/base')
const { VARIABLES, actions, feedbacks, presets } = require('./definitions.js')
const { decode, encode } = require('./osc.js')

/** Time between two requests for the state, which the bridge then sends for a minute. */
const REQUEST_MS = 5_000
/** Silence of the bridge, which sends the state once a second, after which nothing is known of the show. */
const SILENCE_MS = 3_000

class BenchDragon extends InstanceBase {
  async init(config) {
    this.show = { state: 'none', isRefused: false }
    this.setActionDefinitions(actions((command, args) => this.send(command, args)))
    this.setFeedbackDefinitions(feedbacks(this.show))
    this.setVariableDefinitions(VARIABLES)
    this.setPresetDefinitions(presets())
    await this.configUpdated(config)
  }

  async configUpdated(config) {
    await this.destroy()
    this.config = config
    if (!config.host) {
      this.updateStatus(InstanceStatus.BadConfig, 'the address of the show is missing')
      return
    }
    this.updateStatus(InstanceStatus.Connecting)
    const socket = dgram.createSocket('udp4')
    socket.on('message', (packet) => this.take(packet))
    socket.on('error', (error) => this.updateStatus(InstanceStatus.ConnectionFailure, error.message))
    socket.bind(0)
    this.socket = socket
    this.send('state', [])
    this.requests = setInterval(() => this.send('state', []), REQUEST_MS)
    this.expectState()
  }

  async destroy() {
    clearInterval(this.requests)
    clearTimeout(this.silence)
    this.socket?.close()
    this.socket = undefined
  }

  getConfigFields() {
    return [
      { type: 'textinput', id: 'host', label: "Address of the show's machine", width: 8, regex: Regex.IP },
      { type: 'number', id: 'port', label: 'Port of bridge osc --listen', width: 4, min: 1, max: 65535, default: 7400 },
      { type: 'textinput', id: 'secret', label: 'Secret, if the bridge has one', width: 8, default: '' },
    ]
  }

  /** Sends a command. The reply comes as a message. */
  send(command, args) {
    const { host, port, secret } = this.config
    const key = secret ? [{ type: 's', value: secret }] : []
    const packet = encode(`/dragon/${command}`, [...key, ...args])
    this.socket?.send(packet, port, host, (error) => {
      if (error) {
        this.updateStatus(InstanceStatus.ConnectionFailure, error.message)
      }
    })
  }

  take(packet) {
    const { address, args } = decode(packet) ?? {}
    if (address === '/dragon/state') {
      const [state, time, speed] = args
      this.expectState()
      this.updateStatus(InstanceStatus.Ok)
      this.setVariableValues({ show_time: Number(time).toFixed(1), speed: Number(speed).toFixed(2) })
      this.setState(state)
    } else if (address === '/dragon/cue') {
      this.setVariableValues({ cue: args[0] })
    } else if (address === '/dragon/reply') {
      const [command, accepted, , reason] = args
      this.show.isRefused = accepted !== 1
      this.setVariableValues({ reply: this.show.isRefused ? `${command}: ${reason}` : `${command}: accepted` })
      this.checkFeedbacks('refused')
    }
  }

  setState(state) {
    this.show.state = state
    this.setVariableValues({ state })
    this.checkFeedbacks('state')
  }

  /** Waits for the next state. Without one, nobody knows how the show stands. */
  expectState() {
    clearTimeout(this.silence)
    this.silence = setTimeout(() => {
      this.updateStatus(InstanceStatus.ConnectionFailure, 'the bridge does not answer')
      this.setState('silent')
    }, SILENCE_MS)
  }
}

runEntrypoint(BenchDragon, [])

// Actions, feedbacks, variables and presets.

const { combineRgb } = require('@companion-module/base')

const STATES = ['ready', 'running', 'stopping', 'paused', 'held', 'waiting', 'finished', 'ended', 'none', 'silent']
const WHITE = combineRgb(255, 255, 255)
const BLACK = combineRgb(0, 0, 0)
const COLOURS = { red: combineRgb(200, 0, 0), green: combineRgb(0, 130, 40), amber: combineRgb(200, 120, 0), grey: combineRgb(50, 50, 50) }

/** Commands without a number: name, label, and the state and colour in which their button lights. */
const COMMANDS = [
  { id: 'hold', name: 'Hold', state: 'held', colour: COLOURS.red },
  { id: 'release', name: 'Release', state: 'running', colour: COLOURS.green },
  { id: 'pause', name: 'Pause', state: 'paused', colour: COLOURS.amber },
  { id: 'resume', name: 'Resume', state: 'running', colour: COLOURS.green },
  { id: 'go', name: 'Go', state: 'waiting', colour: COLOURS.green },
  { id: 'stop', name: 'Stop', state: 'ended', colour: COLOURS.grey },
]

/** Commands with a number. */
const NUMBERS = [
  { id: 'speed', name: 'Speed', label: 'Metres per second', min: 0, max: 10, default: 1 },
  { id: 'seek', name: 'Seek', label: 'Show time in seconds', min: -1e6, max: 1e6, default: 0 },
  { id: 'pace', name: 'Pace of all dragons, or of a replay', label: 'Factor', min: 0, max: 100, default: 1 },
]

function actions(send) {
  const plain = COMMANDS.map(({ id, name }) => [id, { name, options: [], callback: () => send(id, []) }])
  const numbers = NUMBERS.map(({ id, name, label, ...range }) => [
    id,
    {
      name,
      options: [{ type: 'number', id: 'value', label, step: 0.01, ...range }],
      callback: ({ options }) => send(id, [{ type: 'f', value: Number(options.value) }]),
    },
  ])
  return Object.fromEntries([...plain, ...numbers])
}

function feedbacks(show) {
  return {
    state: {
      type: 'boolean',
      name: 'The show is in a state',
      defaultStyle: { bgcolor: COLOURS.red, color: WHITE },
      options: [
        { type: 'dropdown', id: 'state', label: 'State', default: 'held', choices: STATES.map((id) => ({ id, label: id })) },
      ],
      callback: ({ options }) => show.state === options.state,
    },
    refused: {
      type: 'boolean',
      name: 'The last command was refused',
      defaultStyle: { bgcolor: COLOURS.amber, color: BLACK },
      options: [],
      callback: () => show.isRefused,
    },
  }
}

const VARIABLES = [
  { variableId: 'state', name: 'State of the show' },
  { variableId: 'show_time', name: 'Show time in seconds' },
  { variableId: 'speed', name: 'Speed of the head in metres per second' },
  { variableId: 'cue', name: 'Last cue that the show has reached' },
  { variableId: 'reply', name: 'Reply to the last command' },
]

function presets() {
  const buttons = COMMANDS.map(({ id, name, state, colour }) => [
    id,
    {
      type: 'button',
      category: 'Show',
      name,
      style: { text: name.toUpperCase(), size: '18', color: WHITE, bgcolor: BLACK },
      steps: [{ down: [{ actionId: id, options: {} }], up: [] }],
      feedbacks: [{ feedbackId: 'state', options: { state }, style: { bgcolor: colour, color: WHITE } }],
    },
  ])
  return Object.fromEntries(buttons)
}

module.exports = { VARIABLES, actions, feedbacks, presets }

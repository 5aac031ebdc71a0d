// Open Sound Control: messages with texts (s), 32-bit integers (i) and floats (f).

function padded(text) {
  const bytes = Buffer.from(`${text}\0`)
  return Buffer.concat([bytes, Buffer.alloc((4 - (bytes.length % 4)) % 4)])
}

function argument({ type, value }) {
  if (type === 's') {
    return padded(value)
  }
  const bytes = Buffer.alloc(4)
  if (type === 'f') {
    bytes.writeFloatBE(value)
  } else {
    bytes.writeInt32BE(value)
  }
  return bytes
}

/** The packet of a message. */
function encode(address, args) {
  const types = `,${args.map(({ type }) => type).join('')}`
  return Buffer.concat([padded(address), padded(types), ...args.map(argument)])
}

/** The address and the arguments of a packet; undefined for one that is no message of these types. */
function decode(packet) {
  let at = 0
  const text = () => {
    const end = packet.indexOf(0, at)
    if (end < 0) {
      throw new RangeError('a text has no end')
    }
    const found = packet.toString('utf8', at, end)
    at = end + 4 - (end % 4)
    return found
  }
  const four = (read) => {
    const found = read(at)
    at += 4
    return found
  }
  try {
    const [address, types] = [text(), text()]
    const args = [...types.slice(1)].map((type) => {
      switch (type) {
        case 's':
          return text()
        case 'i':
          return four((from) => packet.readInt32BE(from))
        case 'f':
          return four((from) => packet.readFloatBE(from))
        default:
          throw new RangeError(`the type ${type} is not read`)
      }
    })
    return address.startsWith('/') && types.startsWith(',') ? { address, args } : undefined
  } catch (error) {
    if (error instanceof RangeError) {
      return undefined
    }
    throw error
  }
}

module.exports = { encode, decode }

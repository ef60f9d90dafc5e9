import { describe, expect, test } from 'vitest'
import { parseReplay, ReplayFormatError } from '../../../src/walk/replay/replay'
import { CHANNELS, encoded, frames, header } from './replay-bytes'

describe('a replay', () => {
  const replay = parseReplay(encoded(header(5), frames(5)))

  test('has the values of every frame', () => {
    expect(replay.frames).toBe(5)
    expect(replay.end).toBeCloseTo(0.4)
    expect(replay.value('link_pose', 3, 0)).toBeCloseTo(0.3)
    expect(replay.value('foot_force', 4, 2)).toBe(40)
    expect(Array.from(replay.column('foot_force', 2))).toEqual([0, 10, 20, 30, 40])
  })

  test('has no values of a missing channel', () => {
    expect(replay.channel('current')).toBeUndefined()
    expect(replay.value('current', 0, 0)).toBeNaN()
  })

  test.each([
    [-1, 0],
    [0, 0],
    [0.05, 0],
    [0.1, 1],
    [0.39, 3],
    [0.4, 4],
    [9, 4],
  ])('shows at %d s frame %d', (time, frame) => {
    expect(replay.frameAt(time)).toBe(frame)
  })

  test('interpolates forces between frames', () => {
    const force = new Float32Array(3)
    replay.sample('foot_force', 0.35, force)
    expect(force[2]).toBeCloseTo(35)
  })

  test('is decoded at any alignment', () => {
    const odd = encoded(header(2, { explanation: 'odd' }), frames(2), false)
    const other = encoded(header(2, { explanation: 'odd!' }), frames(2), false)
    for (const bytes of [odd, other]) expect(parseReplay(bytes).value('foot_force', 1, 2)).toBe(10)
  })

  test('may have no frames', () => {
    const none = parseReplay(encoded(header(0), frames(0)))
    expect(none.end).toBe(0)
  })
})

describe('invalid data is refused with advice', () => {
  test.each([
    ['nothing', new ArrayBuffer(0), /empty/],
    [
      'another version',
      encoded(header(1, { version: 2 }), frames(1)),
      /version 2.*reload the page/,
    ],
    ['too few frames', encoded(header(3), frames(2)), /112 bytes of frames.*168/],
    ['too many frames', encoded(header(1), frames(2)), /try again/],
    ['a truncated header', encoded(header(1), frames(1)).slice(0, 40), /truncated/],
    ['no poses', encoded(header(1, { channels: [CHANNELS[0]] }), new Float32Array(1)), /link_pose/],
    ['text', new TextEncoder().encode('\x04\0\0\0oops').buffer as ArrayBuffer, /not JSON/],
  ])('%s', (_, bytes, message) => {
    expect(() => parseReplay(bytes)).toThrow(ReplayFormatError)
    expect(() => parseReplay(bytes)).toThrow(message)
  })

  test('poses of fewer links than the robot has', () => {
    const one = header(1)
    const two = { ...one.robot, links: [...one.robot.links, ...one.robot.links] }
    expect(() => parseReplay(encoded({ ...one, robot: two }, frames(1)))).toThrow(/pose per link/)
  })
})

import { expect, test } from 'vitest'
import {
  extentOf,
  lengthInWords,
  newtonsPerCell,
  roundLength,
  typicalLargest,
} from '../../../src/walk/replay/extent'
import { parseReplay, type Shape } from '../../../src/walk/replay/replay'
import { encoded, frames, header } from './replay-bytes'

/** A box with these edges [m] on the body's link, 0.15 m above the ground. */
function walker(size: number[], turn: [number, number, number, number] = [0, 0, 0, 1]) {
  const shape: Shape = { type: 'box', size, origin: [0, 0, 0, ...turn], role: 'body' }
  const load: Shape = { type: 'sphere', size: [9], origin: [0, 0, 0, 0, 0, 0, 1], role: 'load' }
  const robot = {
    ...header(2).robot,
    links: [{ name: 'body', parent: null, shapes: [shape, load], meshes: [] }],
  }
  return parseReplay(encoded(header(2, { robot }), frames(2)))
}

test('the largest robot of a scene determines the scale, without its load', () => {
  const small = extentOf([walker([0.4, 0.3, 0.1])])
  expect(small.span).toBeCloseTo(0.4)
  // The foot of this robot is at y = 0.2 m.
  expect(small.width).toBeCloseTo(0.35)
  expect(small.height).toBeCloseTo(0.2)
  expect(small.cell).toBe(0.1)
  const both = extentOf([walker([0.4, 0.3, 0.1]), walker([4, 3, 1])])
  expect(both.span).toBeCloseTo(4)
  expect(both.cell).toBe(1)
})

test('the rotation of solids is taken into account', () => {
  const quarter: [number, number, number, number] = [0, 0, Math.SQRT1_2, Math.SQRT1_2]
  const turned = extentOf([walker([0.4, 1, 0.1], quarter)])
  expect(turned.span).toBeCloseTo(1)
  expect(turned.width).toBeCloseTo(0.4)
})

test('a walk without frames has a scale too', () => {
  const none = parseReplay(encoded(header(0), frames(0)))
  expect(extentOf([none]).span).toBeGreaterThan(0)
})

test('force arrows scale with the robot', () => {
  const share = (size: number[]) => {
    const extent = extentOf([walker(size)])
    return extent.cell / newtonsPerCell(50, extent) / extent.span
  }
  expect(share([4, 3, 1]) / share([0.4, 0.3, 0.1])).toBeCloseTo(1, 0)
})

test.each([
  [0.095, 0.1, '10 cm'],
  [0.16, 0.2, '20 cm'],
  [0.0021, 0.002, '0.2 cm'],
  [0.8, 1, '1 m'],
])('%d m is rounded to %d m', (length, expected, words) => {
  expect(roundLength(length)).toBeCloseTo(expected, 9)
  expect(lengthInWords(roundLength(length))).toBe(words)
})

const HEXAPOD = { span: 0.53, width: 0.5, height: 0.2, cell: 0.1 }

test.each([
  [0, 10],
  [20, 10],
  [48, 20],
  [60, 50],
  [0.02, 0.01],
])('forces up to %d N are drawn with a cell for %d N', (largest, expected) => {
  expect(newtonsPerCell(largest, HEXAPOD)).toBeCloseTo(expected)
})

test('a rare impact does not determine the scale', () => {
  const norms = new Float32Array(1000).fill(20)
  norms[500] = 900
  expect(typicalLargest(norms)).toBe(20)
})

import { expect, test } from 'vitest'
import { sampleChannel, samplePoses, slerp } from '../../../src/walk/replay/pose'
import { parseReplay } from '../../../src/walk/replay/replay'
import { encoded, frames, header } from './replay-bytes'

const replay = parseReplay(encoded(header(11), frames(11)))

test('between two frames, a link moves linearly and rotates uniformly', () => {
  const pose = new Float32Array(7)
  samplePoses(replay, 0.25, pose)
  const half = (Math.PI / 4) * 0.25
  expect(pose[0]).toBeCloseTo(0.25)
  expect(pose[2]).toBeCloseTo(0.15)
  expect(pose[5]).toBeCloseTo(Math.sin(half))
  expect(pose[6]).toBeCloseTo(Math.cos(half))
})

test('poses are clamped before the start and after the end', () => {
  const pose = new Float32Array(7)
  samplePoses(replay, -1, pose)
  expect(pose[0]).toBe(0)
  samplePoses(replay, 5, pose)
  expect(pose[0]).toBeCloseTo(1)
})

test('forces are interpolated', () => {
  const force = new Float32Array(3)
  sampleChannel(replay, 'foot_force', 0.35, force)
  expect(force[2]).toBeCloseTo(35)
})

test('a quaternion and its negative are the same attitude', () => {
  const values = new Float32Array([0, 0, 0.6, 0.8, 0, 0, -0.6, -0.8])
  const out = new Float32Array(4)
  slerp(values, 0, 4, 0.5, out, 0)
  expect(Array.from(out).map((v) => Math.abs(v))).toEqual([0, 0, 0.6, 0.8].map(Math.fround))
})

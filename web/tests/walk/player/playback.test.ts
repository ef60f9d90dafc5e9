import { expect, test, vi } from 'vitest'
import { Playback } from '../../../src/walk/player/playback'

test('time advances at the chosen speed', () => {
  const playback = new Playback(4.5, 50)
  playback.advance(1)
  expect(playback.time).toBe(0)
  playback.play()
  playback.advance(1)
  expect(playback.time).toBe(1)
  playback.setSpeed(0.1)
  playback.advance(1)
  expect(playback.time).toBeCloseTo(1.1)
})

test('stops at the end, and restarts from the beginning', () => {
  const playback = new Playback(1, 50)
  playback.play()
  playback.advance(9)
  expect([playback.time, playback.playing]).toEqual([1, false])
  playback.toggle()
  expect([playback.time, playback.playing]).toEqual([0, true])
})

test('steps frame by frame, within the walk', () => {
  const playback = new Playback(0.1, 50)
  playback.step(-1)
  expect(playback.frame).toBe(0)
  playback.step(3)
  expect([playback.frame, playback.time]).toEqual([3, 0.06])
  playback.step(99)
  expect([playback.frame, playback.time]).toEqual([5, 0.1])
})

test('stepping during playback pauses', () => {
  const playback = new Playback(1, 50)
  playback.play()
  playback.step(1)
  expect(playback.playing).toBe(false)
})

test('the speed is limited to between a tenth and four times real time', () => {
  const playback = new Playback(1, 50)
  playback.setSpeed(0)
  expect(playback.speed).toBe(0.1)
  playback.setSpeed(100)
  expect(playback.speed).toBe(4)
})

test('notifies listeners of every change until they unsubscribe', () => {
  const playback = new Playback(1, 50)
  const listener = vi.fn()
  const leave = playback.subscribe(listener)
  playback.seek(0.5)
  leave()
  playback.seek(0.6)
  expect(listener).toHaveBeenCalledTimes(1)
})

test('a walk without frames cannot be played', () => {
  const playback = new Playback(0, 50)
  playback.play()
  expect(playback.playing).toBe(false)
})

test('the last frame is reached although its time is a float32', () => {
  const playback = new Playback(Math.fround(4.49), 100)
  playback.seek(playback.lastFrame / playback.frameRate)
  expect([playback.frame, playback.lastFrame]).toEqual([449, 449])
})

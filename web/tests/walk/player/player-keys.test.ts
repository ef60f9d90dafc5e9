import { describe, expect, test } from 'vitest'
import { Playback } from '../../../src/walk/player/playback'
import { pressed } from '../../../src/walk/player/player-keys'

/** A stub element for `closest`. */
function element(kind: string): Element {
  const is = (selector: string) => selector.split(',').some((each) => each.trim() === kind)
  return { closest: (selector: string) => (is(selector) ? {} : null) } as unknown as Element
}

const ELSEWHERE = element('main')

function playback(): Playback {
  return new Playback(2, 50)
}

test('space plays and pauses', () => {
  const clock = playback()
  expect(pressed(' ', false, ELSEWHERE, clock, null)).toBe(true)
  expect(clock.playing).toBe(true)
})

test('space on a button is left to the button', () => {
  const clock = playback()
  expect(pressed(' ', false, element('button'), clock, null)).toBe(false)
  expect(clock.playing).toBe(false)
})

test('arrows step by frames, home and end seek to the ends', () => {
  const clock = playback()
  for (const key of ['ArrowRight', 'ArrowRight', 'ArrowLeft']) {
    pressed(key, false, ELSEWHERE, clock, null)
  }
  expect(clock.frame).toBe(1)
  pressed('End', false, ELSEWHERE, clock, null)
  expect(clock.time).toBe(2)
  pressed('Home', false, ELSEWHERE, clock, null)
  expect(clock.time).toBe(0)
})

test('arrows in a select are left to the select', () => {
  const clock = playback()
  expect(pressed('ArrowRight', false, element('select'), clock, null)).toBe(false)
  expect(clock.frame).toBe(0)
})

describe('with shift', () => {
  test('arrows rotate the view and do not affect the clock', () => {
    const clock = playback()
    const turns: [number, number][] = []
    const view = { turn: (a: number, b: number) => turns.push([a, b]), zoom: () => {} }
    pressed('ArrowRight', true, ELSEWHERE, clock, view)
    pressed('ArrowUp', true, ELSEWHERE, clock, view)
    expect(turns.map(([a, b]) => [Math.sign(a), Math.sign(b)])).toEqual([
      [1, 0],
      [0, 1],
    ])
    expect(clock.frame).toBe(0)
  })
})

import { expect, test } from 'vitest'
import { CAMERA, DEFAULT_VIEW, MOMENT, VIEW } from '../../../src/walk/player/view-words'

test('a view is written by its deviations from the default', () => {
  expect(VIEW.write(DEFAULT_VIEW)).toBeNull()
  const view = {
    ...DEFAULT_VIEW,
    arrangement: 'side-by-side',
    follow: false,
    trail: false,
  } as const
  expect(VIEW.write(view)).toBe('side-by-side,still,no-trail')
  expect(VIEW.read('side-by-side,still,no-trail')).toEqual(view)
  expect(VIEW.read('besides')).toBeUndefined()
  expect(VIEW.read('toString')).toBeUndefined()
})

test('a moment is a non-negative time', () => {
  expect(MOMENT.read(MOMENT.write(1 / 3)!)).toBe(0.3333)
  for (const wrong of ['', '-1', 'soon', 'Infinity']) expect(MOMENT.read(wrong)).toBeUndefined()
})

test('a camera is six short numbers', () => {
  const place = { position: [0.81234, -1.2, 0.5], target: [0, -0.0001, 2] } as const
  expect(CAMERA.write(place)).toBe('0.812:-1.2:0.5:0:0:2')
  expect(CAMERA.read('0.812:-1.2:0.5:0:0:2')).toEqual({
    position: [0.812, -1.2, 0.5],
    target: [0, 0, 2],
  })
  expect(CAMERA.write(null)).toBeNull()
  const wrong = ['', '1:2:3', '1:2:3:4:5:', '1:2:3:4:5:6:7', '1:2:3:4:5:Infinity', '1:2:3:1:2:3']
  for (const text of wrong) expect(CAMERA.read(text)).toBeUndefined()
})

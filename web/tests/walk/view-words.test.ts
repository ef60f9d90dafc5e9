import { expect, test } from 'vitest'
import { MOMENT, USUAL_VIEW, VIEW } from '../../src/walk/view-words'

test('a view is written by what differs from the usual', () => {
  expect(VIEW.write(USUAL_VIEW)).toBeNull()
  const view = { ...USUAL_VIEW, arrangement: 'beside', follow: false, trail: false } as const
  expect(VIEW.write(view)).toBe('beside,still,no-trail')
  expect(VIEW.read('beside,still,no-trail')).toEqual(view)
  expect(VIEW.read('besides')).toBeUndefined()
  expect(VIEW.read('toString')).toBeUndefined()
})

test('a moment is a time from the beginning', () => {
  expect(MOMENT.read(MOMENT.write(1 / 3)!)).toBe(0.3333)
  for (const wrong of ['', '-1', 'soon', 'Infinity']) expect(MOMENT.read(wrong)).toBeUndefined()
})

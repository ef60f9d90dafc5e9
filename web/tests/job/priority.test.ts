import { expect, test } from 'vitest'
import { isPriority } from '../../src/job/facts'

test.each(['-10', '0', ' 7 ', '10'])('%s is a priority', (text) => {
  expect(isPriority(text)).toBe(true)
})

test.each(['', ' ', '11', '-11', '0.5', 'high'])('%s is none', (text) => {
  expect(isPriority(text)).toBe(false)
})

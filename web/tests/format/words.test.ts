import { expect, test } from 'vitest'
import { capitalized, inWords, sentence } from '../../src/format/words'

test('names are written in words', () => {
  expect(inWords('angular_acceleration')).toBe('angular acceleration')
  expect(inWords('least reciprocal_speed')).toBe('least time per metre')
  expect(capitalized('error')).toBe('Error')
})

test('a message becomes a sentence, and a sentence is unchanged', () => {
  expect(sentence("there is no job 'none'")).toBe("There is no job 'none'.")
  expect(sentence('Choose one of those above.')).toBe('Choose one of those above.')
  expect(sentence('')).toBe('')
})

import { describe, expect, test } from 'vitest'
import {
  change,
  exactQuantity,
  formatCount,
  formatExact,
  formatNumber,
  percent,
  quantity,
  writtenUnit,
} from '../../src/format/number'
import { formatAge, formatDuration, formatMoment } from '../../src/format/time'
import { exactValueQuantity, formatValue, named, valueQuantity } from '../../src/format/value'

const THIN = '\u202f'
const SPACE = '\u00a0'

describe('values of a design', () => {
  test('are names of choices in words, without a unit', () => {
    expect(formatValue('linear_zone')).toBe('linear zone')
    expect([valueQuantity('stick', 'V'), exactValueQuantity('stick', 'V')]).toEqual([
      'stick',
      'stick',
    ])
  })

  test('are numbers like all others', () => {
    expect(formatValue(8.71359)).toBe('8.714')
    expect(exactValueQuantity(0.5, 's')).toBe(`0.5${SPACE}s`)
  })

  test('are looked up by the index of a choice', () => {
    const laws = ['karnopp', 'stick']
    expect([0, 1].map((index) => named(index, laws))).toEqual(laws)
    expect(named(1, [])).toBe(1)
  })
})

describe('numbers', () => {
  test.each([
    [8.71359, '8.714'],
    [0.00123456, '0.001235'],
    [12345.678, `12${THIN}346`],
    [1234.5, '1235'],
    [-0.0038, '−0.003800'],
    [0, '0'],
    [1.5e-9, '1.50e−9'],
    [2.5e12, '2.50e12'],
  ])('%d is written %s', (value, text) => {
    expect(formatNumber(value)).toBe(text)
  })

  test.each([null, undefined, Number.NaN, Number.POSITIVE_INFINITY])('%s is a dash', (value) => {
    expect(formatNumber(value)).toBe('–')
    expect(quantity(value, 'N')).toBe('–')
  })

  test('exact numbers have no trailing zeros, but integers keep theirs', () => {
    expect(formatExact(0.5)).toBe('0.5')
    expect(formatExact(24000)).toBe(`24${THIN}000`)
    expect(formatExact(100)).toBe('100')
    expect(exactQuantity(2, '1')).toBe('2')
  })

  test('counts are written in full', () => {
    expect(formatCount(100000)).toBe(`100${THIN}000`)
  })

  test('units are written, except for dimensionless values', () => {
    expect(quantity(8.71359, 'N m')).toBe(`8.714${SPACE}N m`)
    expect(quantity(8.71359, '1')).toBe('8.714')
    expect(percent(0.1234)).toBe(`12.3${SPACE}%`)
  })

  test('changes have a sign', () => {
    expect(change(3.2, '%', 2)).toBe(`+3.2${SPACE}%`)
    expect(change(-3.2, '%', 2)).toBe(`−3.2${SPACE}%`)
  })
})

describe('times', () => {
  test.each([
    [0.42, `0.42${SPACE}s`],
    [7.25, `7.3${SPACE}s`],
    [59.4, `59${SPACE}s`],
    [185, `3${SPACE}min 05${SPACE}s`],
    [3599.6, `1${SPACE}h 00${SPACE}min`],
    [8040, `2${SPACE}h 14${SPACE}min`],
    [273_600, `3${SPACE}d 04${SPACE}h`],
  ])('%d s is written %s', (seconds, text) => {
    expect(formatDuration(seconds)).toBe(text)
  })

  test('missing durations are a dash', () => {
    expect(formatDuration(null)).toBe('–')
    expect(formatDuration(-1)).toBe('–')
  })

  test('ages have one unit, and are never negative', () => {
    const now = Date.parse('2026-03-01T12:00:00Z')
    expect(formatAge('2026-03-01T11:59:55Z', now)).toBe(`5${SPACE}s`)
    expect(formatAge('2026-03-01T09:30:00Z', now)).toBe(`2${SPACE}h`)
    expect(formatAge('2026-03-01T12:00:09Z', now)).toBe(`0${SPACE}s`)
  })

  test('an invalid moment is a dash', () => {
    expect(formatMoment('never')).toBe('–')
  })
})

test('units are written typographically', () => {
  expect(writtenUnit('rad/s2')).toBe('rad/s²')
  expect(writtenUnit('kg m2')).toBe('kg m²')
  expect(writtenUnit('ohm')).toBe('Ω')
  expect(writtenUnit('counts/s')).toBe('counts/s')
  expect(quantity(0.4, 'ohm', 1)).toBe('0.4\u00a0Ω')
})

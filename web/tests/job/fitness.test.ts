import { expect, test } from 'vitest'
import { caseWords, fitnessUnit } from '../../src/job/facts'

const currents = [{ name: 'current_link_1', unit: 'mA', description: 'error' }]

test('only the fitness of an identification has a unit, that of its objectives', () => {
  expect(fitnessUnit({ kind: 'tuning', objectives: currents })).toBe('1')
  expect(fitnessUnit({ kind: 'identification', objectives: currents })).toBe('mA')
  expect(fitnessUnit({ kind: 'calibration', objectives: currents })).toBe('1')
})

test('the fitness of an identification summary is in ampere', () => {
  expect(fitnessUnit({ kind: 'identification' })).toBe('A')
})

test('each kind of job has its own terms', () => {
  expect(caseWords('tuning').items).toBe('scenarios')
  expect(caseWords('identification').measure).toBe('error')
  expect(caseWords('calibration')).toMatchObject({ items: 'walks', measure: 'misfit' })
})

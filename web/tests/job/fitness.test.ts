import { expect, test } from 'vitest'
import { caseWords, fitnessUnit } from '../../src/job/fitness'

const currents = [{ name: 'current_link_1', unit: 'mA', description: 'error' }]

test('the fitness of a tuning or calibration has no unit, that of an identification the unit of its objectives', () => {
  expect(fitnessUnit({ kind: 'tuning', objectives: currents })).toBe('1')
  expect(fitnessUnit({ kind: 'identification', objectives: currents })).toBe('mA')
  expect(fitnessUnit({ kind: 'calibration', objectives: currents })).toBe('1')
})

test('summaries, which have no objectives, have currents in ampere', () => {
  expect(fitnessUnit({ kind: 'identification' })).toBe('A')
})

test('what is judged is called by its name', () => {
  expect(caseWords('tuning').many).toBe('scenarios')
  expect(caseWords('identification').worth).toBe('error')
  expect(caseWords('calibration')).toMatchObject({ many: 'walks', worth: 'misfit' })
})

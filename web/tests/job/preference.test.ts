import { describe, expect, test } from 'vitest'
import type { Preference, ScenarioResult } from '../../src/api/types'
import {
  analyse,
  preferenceIn,
  preferenceQuery,
  utilityOf,
  weighed,
} from '../../src/job/preference'

const PREFERENCE: Preference = { bias: [0, 0, 0, 0, 1], exponent: [1, 0, 0, 2, 1] }

const walked = (torque: number, energy: number, reciprocal_speed: number): ScenarioResult => ({
  status: 'ok',
  explanation: '',
  utility: null,
  objectives: { torque, acceleration: 1, angular_acceleration: 1, energy, reciprocal_speed },
})

describe('a preference in an address', () => {
  const read = (preference: string) => preferenceIn(new URLSearchParams({ preference }))

  test('is read as written', () => {
    expect(read(preferenceQuery(PREFERENCE))).toEqual(PREFERENCE)
  })

  test('is undefined if invalid', () => {
    expect(preferenceIn(new URLSearchParams())).toBeUndefined()
    for (const text of [
      'A',
      '{}',
      '{"bias":[1],"exponent":[1,2]}',
      '{"bias":["a"],"exponent":[1]}',
    ]) {
      expect(read(text)).toBeUndefined()
    }
  })
})

describe('the utility', () => {
  test('is the product of (b + f) ** e', () => {
    expect(utilityOf(walked(3, 2, 4), PREFERENCE)).toBeCloseTo(3 * 2 ** 2 * 5, 12)
  })

  test('weights as many objectives as the preference has, and height loss by magnitude', () => {
    const six = { bias: [...PREFERENCE.bias, 0.03], exponent: [...PREFERENCE.exponent, 1] }
    const sunk = walked(3, 2, 4)
    const result = { ...sunk, objectives: { ...sunk.objectives, height_loss: -0.01 } }
    expect(utilityOf(result, PREFERENCE)).toBeCloseTo(60, 12)
    expect(utilityOf(result, six)).toBeCloseTo(60 * 0.04, 12)
    expect(weighed(PREFERENCE)).toHaveLength(5)
    expect(weighed(six)).toHaveLength(6)
  })

  test('is null for a failed simulation', () => {
    expect(utilityOf({ ...walked(3, 2, 4), status: 'fell' }, PREFERENCE)).toBeNull()
  })
})

describe('the limiting factor of a design', () => {
  const analysis = analyse({ flat: walked(3, 2, 4), steep: walked(3, 10, 4) }, PREFERENCE)!

  test('is the factor of greatest contribution in the scenario of greatest utility', () => {
    expect(analysis.worstScenario).toBe('steep')
    expect(analysis.worstFactor).toMatchObject({ scenario: 'steep', objective: 'energy' })
    expect(analysis.worstFactor.contribution).toBeCloseTo(2 * Math.log(10 / Math.sqrt(20)), 12)
  })

  test('the excess over the geometric mean is the root of the ratio of two utilities', () => {
    expect(analysis.excess).toBeCloseTo(Math.sqrt(25), 12)
  })

  test('contributions add up to the logarithm of the relative utility', () => {
    const sum = analysis.factors
      .filter((factor) => factor.scenario === 'flat')
      .reduce((total, factor) => total + factor.contribution, 0)
    expect(sum).toBeCloseTo(Math.log(2 ** 2 / (2 * 10)), 12)
    expect(sum).toBeCloseTo(analysis.utilities.flat, 12)
  })

  test('does not depend on units', () => {
    const inMillimetres = { flat: walked(3000, 2, 4), steep: walked(3300, 2.1, 4) }
    const inMetres = { flat: walked(3, 2, 4), steep: walked(3.3, 2.1, 4) }
    const [one, other] = [inMillimetres, inMetres].map((walks) => analyse(walks, PREFERENCE)!)
    expect(one.worstFactor.objective).toBe(other.worstFactor.objective)
    expect(one.worstFactor.contribution).toBeCloseTo(other.worstFactor.contribution, 12)
  })

  test('sensitivities equal finite differences of the fitness', () => {
    const fitness = (energy: number) =>
      Math.sqrt(
        utilityOf(walked(3, 2, 4), PREFERENCE)! * utilityOf(walked(3, energy, 4), PREFERENCE)!,
      )
    const slope = (Math.log(fitness(10.001)) - Math.log(fitness(10))) / Math.log(10.001 / 10)
    expect(analysis.worstFactor.sensitivity).toBeCloseTo(slope, 6)
  })

  test('unweighted objectives are not included', () => {
    expect(analysis.factors.some((factor) => factor.objective === 'acceleration')).toBe(false)
  })

  test('is null if a simulation failed', () => {
    const fallen = { ...walked(3, 2, 4), status: 'fell' as const }
    expect(analyse({ flat: walked(3, 2, 4), steep: fallen }, PREFERENCE)).toBeNull()
  })
})

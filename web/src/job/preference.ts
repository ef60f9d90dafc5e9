/** Bias-weighted product and its factors (eq. 3.8, 4.1, 4.2). */

import type { Preference, ScenarioResult } from '../api/types'

/** Objectives that a preference can weight, in order: f1..f6 of table 4.1. */
const PREFERRED = [
  'torque',
  'acceleration',
  'angular_acceleration',
  'energy',
  'reciprocal_speed',
  'height_loss',
] as const

/** The objectives weighted by a preference, by its number of entries. */
export function weighed({ bias }: { readonly bias: readonly unknown[] }): readonly string[] {
  return PREFERRED.slice(0, bias.length)
}

export function preferenceIn(query: URLSearchParams): Preference | undefined {
  return preferenceOf(query.get('preference') ?? '')
}

export function preferenceOf(text: string): Preference | undefined {
  try {
    const { bias, exponent } = JSON.parse(text) as Partial<Preference>
    const numbers = [bias, exponent].every((part) => part?.every(Number.isFinite))
    return numbers && bias?.length === exponent?.length
      ? ({ bias, exponent } as Preference)
      : undefined
  } catch {
    return undefined
  }
}

export function preferenceQuery({ bias, exponent }: Preference): string {
  return JSON.stringify({ bias, exponent })
}

/** One factor (b + f)^e of a scenario's utility. */
export interface Factor {
  readonly scenario: string
  readonly objective: string
  readonly value: number
  /**
   * e ln((b + f) / geometric mean of b + f over the scenarios): contribution to the logarithm of the
   * scenario's utility relative to the mean. A ratio of like quantities, hence independent of units.
   */
  readonly contribution: number
  /** Relative change of the fitness per relative change of the objective. */
  readonly sensitivity: number
}

export interface Analysis {
  readonly factors: readonly Factor[]
  /** Logarithm of each scenario's utility over the geometric mean of all. */
  readonly utilities: Readonly<Record<string, number>>
  readonly worstScenario: string
  readonly worstFactor: Factor
  /** Utility of the worst scenario over the geometric mean of all. */
  readonly excess: number
}

/** Compare the factors of each scenario with those of the others; null if a simulation failed. */
export function analyse(
  scenarios: Readonly<Record<string, ScenarioResult>>,
  preference: Preference,
): Analysis | null {
  const names = Object.keys(scenarios)
  const absolute: Factor[] = []
  const utilities: Record<string, number> = {}
  for (const scenario of names) {
    const scenarioFactors = factorsOf(scenario, scenarios[scenario], preference, names.length)
    if (scenarioFactors === null) return null
    absolute.push(...scenarioFactors)
  }
  if (absolute.length === 0) return null
  const factors = absolute.map((factor) => {
    const like = absolute.filter(({ objective }) => objective === factor.objective)
    const mean = like.reduce((sum, { contribution }) => sum + contribution, 0) / like.length
    return { ...factor, contribution: factor.contribution - mean }
  })
  for (const scenario of names) {
    const scenarioFactors = factors.filter((factor) => factor.scenario === scenario)
    utilities[scenario] = scenarioFactors.reduce((sum, f) => sum + f.contribution, 0)
  }
  const worstScenario = names.reduce((a, b) => (utilities[b] > utilities[a] ? b : a))
  const worstFactor = factors
    .filter((f) => f.scenario === worstScenario)
    .reduce((a, b) => (b.contribution > a.contribution ? b : a))
  const excess = Math.exp(utilities[worstScenario])
  return { factors, utilities, worstScenario, worstFactor, excess }
}

/** Utility of one simulation under a preference (eq. 4.1); null if it failed. */
export function utilityOf(result: ScenarioResult, preference: Preference): number | null {
  const factors = factorsOf('', result, preference, 1)
  return factors && Math.exp(factors.reduce((sum, f) => sum + f.contribution, 0))
}

/** Factors of one simulation, with contributions e ln(b + f). */
function factorsOf(
  scenario: string,
  result: ScenarioResult,
  { bias, exponent }: Preference,
  scenarios: number,
): Factor[] | null {
  if (result.status !== 'ok') return null
  const factors: Factor[] = []
  for (const [m, objective] of weighed({ bias }).entries()) {
    const [b, e, value] = [bias[m], exponent[m], result.objectives[objective]]
    if (e === 0) continue
    if (value === null || value === undefined) return null
    // Height loss is signed; only its magnitude counts.
    const f = objective === 'height_loss' ? Math.abs(value) : value
    if (!(b + f > 0)) return null
    factors.push({
      scenario,
      objective,
      value,
      contribution: e * Math.log(b + f),
      sensitivity: (e * f) / (b + f) / scenarios,
    })
  }
  return factors
}

/** The bias-weighted product and its parts (eq. 3.8, 4.1, 4.2), to explain what limits a design. */

import type { Preference, ScenarioResult } from '../api/types'

/** The objectives that a preference may weigh, in its order: f1..f6 of table 4.1. */
const PREFERRED = [
  'torque',
  'acceleration',
  'angular_acceleration',
  'energy',
  'reciprocal_speed',
  'height_loss',
] as const

/** The objectives that a preference of so many entries weighs. */
export function weighed({ bias }: { readonly bias: readonly unknown[] }): readonly string[] {
  return PREFERRED.slice(0, bias.length)
}

/** The preference that a query asks for; undefined if it has none that can be read. */
export function preferenceIn(query: URLSearchParams): Preference | undefined {
  return preferenceOf(query.get('preference') ?? '')
}

/** A preference as JSON; undefined if it is none. */
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

/** What `preferenceIn` reads. */
export function preferenceQuery({ bias, exponent }: Preference): string {
  return JSON.stringify({ bias, exponent })
}

/** One factor (b + f)^e of a scenario's utility. */
export interface Factor {
  readonly scenario: string
  readonly objective: string
  readonly value: number
  /**
   * e ln((b + f) / geometric mean of b + f over the scenarios): what it adds to the logarithm of the
   * scenario's utility over that of all. No unit decides it, as it is a ratio of like things.
   */
  readonly contribution: number
  /** Change of the fitness, as a share of it, per relative change of the objective. */
  readonly sensitivity: number
}

/** Why a design is worth what it is. */
export interface Analysis {
  readonly factors: readonly Factor[]
  /** Logarithm of each scenario's utility over the geometric mean of all. */
  readonly utilities: Readonly<Record<string, number>>
  /** The scenario of greatest utility, that is, of the worst. */
  readonly worstScenario: string
  /** The factor of greatest contribution in that scenario. */
  readonly worstFactor: Factor
  /** Utility of the worst scenario over the geometric mean of all. */
  readonly excess: number
}

/** The factors of every scenario's utility against those of the others; null if a walk failed. */
export function analyse(
  scenarios: Readonly<Record<string, ScenarioResult>>,
  preference: Preference,
): Analysis | null {
  const names = Object.keys(scenarios)
  const absolute: Factor[] = []
  const utilities: Record<string, number> = {}
  for (const scenario of names) {
    const own = factorsOf(scenario, scenarios[scenario], preference, names.length)
    if (own === null) return null
    absolute.push(...own)
  }
  if (absolute.length === 0) return null
  const factors = absolute.map((factor) => {
    const like = absolute.filter(({ objective }) => objective === factor.objective)
    const mean = like.reduce((sum, { contribution }) => sum + contribution, 0) / like.length
    return { ...factor, contribution: factor.contribution - mean }
  })
  for (const scenario of names) {
    const own = factors.filter((factor) => factor.scenario === scenario)
    utilities[scenario] = own.reduce((sum, f) => sum + f.contribution, 0)
  }
  const worstScenario = names.reduce((a, b) => (utilities[b] > utilities[a] ? b : a))
  const worstFactor = factors
    .filter((f) => f.scenario === worstScenario)
    .reduce((a, b) => (b.contribution > a.contribution ? b : a))
  const excess = Math.exp(utilities[worstScenario])
  return { factors, utilities, worstScenario, worstFactor, excess }
}

/** Utility of one walk under a preference (eq. 4.1); null if it failed. */
export function utilityOf(result: ScenarioResult, preference: Preference): number | null {
  const factors = factorsOf('', result, preference, 1)
  return factors && Math.exp(factors.reduce((sum, f) => sum + f.contribution, 0))
}

/** The factors of one walk, each contribution e ln(b + f) by itself. */
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
    // The loss of height has a sign, and counts by its size.
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

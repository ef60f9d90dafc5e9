/** Outputs for which importance is estimated: fitness, failure and each objective. */

import type { Importance, ImportanceIndex, VariableImportance } from '../../api/types'
import { inWords } from '../../format/words'

/** Name of an output, as in the address. */
export type Output = string

/** The fitness, and the outputs with an estimate for at least one variable. */
export function outputsOf(importance: Importance): readonly Output[] {
  const all = ['fitness', ...importance.objectives, 'failing']
  const hasEstimate = (output: Output) =>
    importance.variables.some((v) => indexOf(v, output) !== null)
  return all.filter((output) => output === 'fitness' || hasEstimate(output))
}

export function outputWords(output: Output): string {
  return output === 'failing' ? 'failing' : inWords(output)
}

export function indexOf(variable: VariableImportance, output: Output): ImportanceIndex | null {
  if (output === 'fitness') return variable.fitness
  if (output === 'failing') return variable.failing
  return variable.objectives[output] ?? null
}

/** Variables by decreasing importance for an output. */
export function byImportance(
  importance: Importance,
  output: Output,
): readonly VariableImportance[] {
  const value = (variable: VariableImportance) => indexOf(variable, output)?.value ?? -1
  return [...importance.variables].sort((a, b) => value(b) - value(a))
}

/** Wider bounds as a query value of the new-job form: `P:0.05:1.5,I:0:2`. */
export function widenQuery(importance: Importance): string {
  return importance.variables
    .flatMap(({ name, widened }) => (widened ? [`${name}:${widened.low}:${widened.high}`] : []))
    .join(',')
}

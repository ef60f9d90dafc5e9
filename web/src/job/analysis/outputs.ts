/** What the importance of variables is told for: fitness, failing, and each objective. Pure. */

import type { Importance, ImportanceIndex, VariableImportance } from '../../api/types'
import { inWords } from '../../format/words'

/** Name of an output, as it stands in the address. */
export type Output = string

/** Outputs of which something is known of at least one variable, and the fitness. */
export function outputsOf(found: Importance): readonly Output[] {
  const all = ['fitness', ...found.objectives, 'failing']
  const known = (output: Output) => found.variables.some((v) => indexOf(v, output) !== null)
  return all.filter((output) => output === 'fitness' || known(output))
}

export function outputWords(output: Output): string {
  return output === 'failing' ? 'whether a design fails' : inWords(output)
}

export function indexOf(variable: VariableImportance, output: Output): ImportanceIndex | null {
  if (output === 'fitness') return variable.fitness
  if (output === 'failing') return variable.failing
  return variable.objectives[output] ?? null
}

/** Variables by what they do to an output, those that matter most first. */
export function byImportance(found: Importance, output: Output): readonly VariableImportance[] {
  const value = (variable: VariableImportance) => indexOf(variable, output)?.value ?? -1
  return [...found.variables].sort((a, b) => value(b) - value(a))
}

/** Bounds to search anew, as the form of a new job takes them: `P:0.05:1.5,I:0:2`. */
export function widenQuery(found: Importance): string {
  return found.variables
    .flatMap(({ name, widened }) => (widened ? [`${name}:${widened.low}:${widened.high}`] : []))
    .join(',')
}

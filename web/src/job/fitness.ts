/** Unit and terms of the fitness, by kind of job. */

import type { Job, StoredJob } from '../api/types'

/** Unit of a job's fitness: dimensionless, except for identification, which averages errors in current. */
export function fitnessUnit({
  kind,
  objectives,
}: {
  /** Null for an unreadable job. */
  readonly kind: StoredJob['kind']
  /** Missing in summaries. */
  readonly objectives?: Job['objectives']
}): string {
  return kind !== 'identification' ? '1' : (objectives?.[0]?.unit ?? 'A')
}

/** Terms for the components of the fitness. */
export interface CaseWords {
  /** What is evaluated: singular and plural. */
  readonly item: string
  readonly items: string
  /** Its measure: singular and plural. */
  readonly measure: string
  readonly measures: string
  /** How the fitness combines the measures. */
  readonly note: string
}

const MEAN = 'The fitness is their mean'

const SCENARIOS: CaseWords = {
  item: 'scenario',
  items: 'scenarios',
  measure: 'utility',
  measures: 'utilities',
  note: MEAN,
}

const WORDS: Readonly<Partial<Record<Job['kind'], CaseWords>>> = {
  identification: {
    item: 'recording',
    items: 'recordings',
    measure: 'error',
    measures: 'errors',
    note: MEAN,
  },
  calibration: {
    item: 'walk',
    items: 'walks',
    measure: 'misfit',
    measures: 'misfits',
    note: 'Root mean square of the deviations from the fitted targets of a walk, in tolerances',
  },
}

export function caseWords(kind: Job['kind']): CaseWords {
  return WORDS[kind] ?? SCENARIOS
}

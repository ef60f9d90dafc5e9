/** What a job's fitness is, by the kind of job. */

import type { Job, StoredJob } from '../api/types'

/**
 * Unit of a job's fitness: the product that tunes a drive has none, nor has a calibration's count of
 * tolerances; an identification's is a mean of its objectives, which are currents.
 */
export function fitnessUnit({
  kind,
  objectives,
}: {
  /** Null for a job that cannot be read. */
  readonly kind: StoredJob['kind']
  /** Summaries are without them. */
  readonly objectives?: Job['objectives']
}): string {
  return kind !== 'identification' ? '1' : (objectives?.[0]?.unit ?? 'A')
}

/** What the parts of a fitness are called. */
export interface CaseWords {
  /** One walk of which several are judged, and several. */
  readonly one: string
  readonly many: string
  /** What a walk is worth, and what several are. */
  readonly worth: string
  readonly worths: string
  /** What that is to the fitness. */
  readonly bars: string
}

const MEAN = 'What the fitness is the mean of'

const SCENARIOS: CaseWords = {
  one: 'scenario',
  many: 'scenarios',
  worth: 'utility',
  worths: 'utilities',
  bars: MEAN,
}

const WORDS: Readonly<Partial<Record<Job['kind'], CaseWords>>> = {
  identification: {
    one: 'recording',
    many: 'recordings',
    worth: 'error',
    worths: 'errors',
    bars: MEAN,
  },
  calibration: {
    one: 'walk',
    many: 'walks',
    worth: 'misfit',
    worths: 'misfits',
    bars: 'Root mean square of how many tolerances the fitted targets of a walk are off',
  },
}

export function caseWords(kind: Job['kind']): CaseWords {
  return WORDS[kind] ?? SCENARIOS
}

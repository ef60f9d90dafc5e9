/** Robots with published designs. */

import type { JobSpec } from './types'

/** Whether the published designs and the preset scenarios apply: those of Szabadka-II and its variants. */
export function isPublished(robot: JobSpec['robot'] | undefined): boolean {
  return robot === undefined || typeof robot === 'string' || !('toml' in robot)
}

export const NOT_PUBLISHED = 'There is no published design for this robot.'

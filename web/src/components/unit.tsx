/** A unit in brackets after a label; nothing for the unit `1`. */

import { writtenUnit } from '../format/number'

export function Unit({ unit }: { unit: string | null | undefined }) {
  if (!unit || unit === '1') return null
  return <span class="unit"> [{writtenUnit(unit)}]</span>
}

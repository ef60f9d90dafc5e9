/** Names and units as text. */

import { Fragment } from 'preact'
import { writtenUnit } from '../format/number'

/** Parts of an API name between which it may wrap. */
export function partsOf(name: string): readonly string[] {
  return name.split(/(?<=[_-])/)
}

/** An API name that may wrap after its underscores. */
export function BrokenName({ name }: { name: string }) {
  return (
    <>
      {partsOf(name).map((part, k) => (
        <Fragment key={k}>
          {k > 0 && <wbr />}
          {part}
        </Fragment>
      ))}
    </>
  )
}

/** A unit in brackets after a label; nothing for the unit `1`. */
export function Unit({ unit }: { unit: string | null | undefined }) {
  if (!unit || unit === '1') return null
  return <span class="unit"> [{writtenUnit(unit)}]</span>
}

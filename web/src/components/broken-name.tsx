/** An API name that may wrap after its underscores. */

import { Fragment } from 'preact'

export function BrokenName({ name }: { name: string }) {
  const parts = name.split(/(?<=_)/)
  return (
    <>
      {parts.map((part, k) => (
        <Fragment key={k}>
          {k > 0 && <wbr />}
          {part}
        </Fragment>
      ))}
    </>
  )
}

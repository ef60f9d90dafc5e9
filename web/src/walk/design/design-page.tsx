/** Common parts of the walk and controller pages, whose address identifies a design. */

import type { ComponentChildren } from 'preact'
import { ErrorNotice } from '../../components/feedback'
import { useProgress } from '../../job/live/use-progress'
import { ALL_JOBS, Breadcrumbs, type Crumb } from '../../router/breadcrumbs'
import { usePlace } from '../../router/navigation'
import { jobPath, withQuery } from '../../router/routes'
import { type DesignSource, queryOf } from './design-source'
import type { ResolvedDesign } from './resolve-design'

/** Parse the address and show the page, or an error for an invalid address. */
export function DesignPage<A>({
  title,
  what,
  path,
  read,
  children,
}: {
  title: string
  /** Noun for the error message: "Invalid address of a walk." */
  what: string
  /** Path of the page; without a query it shows the published optimum. */
  path: string
  /** Throws AddressError. */
  read: (query: URLSearchParams) => A
  children: (address: A, query: URLSearchParams) => ComponentChildren
}) {
  const { query } = usePlace()
  const [address, error] = attempt(() => read(query))
  if (address !== null) return <>{children(address, query)}</>
  return (
    <>
      <h1>{title}</h1>
      <ErrorNotice what={`Invalid address of a ${what}.`} error={error} />
      <p class="row">
        <a class="button" href={path}>
          Show the published optimum A
        </a>
      </p>
    </>
  )
}

/** Heading and breadcrumbs, below the job of the design. */
export function DesignHeading({
  title,
  path,
  design,
  details = [],
}: {
  title: string
  path: string
  /** Null while loading. */
  design: ResolvedDesign | null
  /** Further parts of the document title. */
  details?: readonly string[]
}) {
  const progress = useProgress(design?.job)
  const shown = design ? [[design.label, ...details].join(', ')] : []
  return (
    <>
      <Breadcrumbs
        {...placeOf(title, path, design)}
        title={[...shown, ...(progress ? [progress] : []), title]}
      />
      <div class="page-header">
        <h1>{title}</h1>
      </div>
    </>
  )
}

function placeOf(title: string, path: string, design: ResolvedDesign | null) {
  const { job, source } = design ?? {}
  if (!design || !job)
    return { crumbs: design ? [[title, path] as const] : [], here: design?.label ?? title }
  const crumbs: Crumb[] = [ALL_JOBS, [job.name || job.id, jobPath(job.id)]]
  if (source?.kind !== 'particle') return { crumbs, here: `${title} of the best` }
  const { iteration, particle } = source
  crumbs.push(['Iterations', jobPath(job.id, 'iterations')])
  crumbs.push([String(iteration), jobPath(job.id, `iterations/${iteration}`)])
  return { crumbs, here: `${title} of design ${particle}` }
}

/** Links to the design's other page and to its job. */
export function DesignLinks({
  source,
  path,
  label,
}: {
  source: DesignSource
  /** Path of the other page; null if it does not apply. */
  path: string | null
  label: string
}) {
  const set = Object.entries(queryOf(source)).filter(([, value]) => value !== null)
  const query = Object.fromEntries(set) as Record<string, string>
  return (
    <div class="row">
      {path !== null && (
        <a class="button" href={withQuery(path, query)}>
          {label}
        </a>
      )}
      {'job' in source && (
        <a class="button" href={jobPath(source.job)}>
          Show job
        </a>
      )}
    </div>
  )
}

function attempt<A>(read: () => A): [A | null, unknown] {
  try {
    return [read(), null]
  } catch (error) {
    return [null, error]
  }
}

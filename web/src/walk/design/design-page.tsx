/** Common parts of the walk and controller pages, whose address identifies a design. */

import type { ComponentChildren } from 'preact'
import { useState } from 'preact/hooks'
import { get } from '../../api/client'
import { usePolling } from '../../api/resource'
import type { StoredJob } from '../../api/types'
import { ErrorNotice } from '../../components/feedback'
import { isActive, progressInWords } from '../../job/facts'
import { ALL_JOBS, Breadcrumbs, type Crumb } from '../../router/breadcrumbs'
import { usePlace } from '../../router/navigation'
import { jobPath, withQuery } from '../../router/routes'
import { type DesignSource, queryOf } from './design-source'
import type { ResolvedDesign } from './resolve-design'

interface DesignPageProps<A> {
  title: string
  path: string
  /** Throws AddressError. */
  read: (query: URLSearchParams) => A
  children: (address: A, query: URLSearchParams) => ComponentChildren
}

/** Parse the address and show the page, or an error for an invalid address. */
export function DesignPage<A>({ title, path, read, children }: DesignPageProps<A>) {
  const { query } = usePlace()
  let address: A
  try {
    address = read(query)
  } catch (error) {
    return (
      <>
        <h1>{title}</h1>
        <ErrorNotice what={`Invalid address of a ${title.toLowerCase()}.`} error={error} />
        <p class="row">
          <a class="button" href={path}>
            Show the published optimum A
          </a>
        </p>
      </>
    )
  }
  return <>{children(address, query)}</>
}

interface DesignHeadingProps {
  title: string
  path: string
  design: ResolvedDesign | null
  details?: readonly string[]
}

export function DesignHeading({ title, path, design, details = [] }: DesignHeadingProps) {
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
  const { job, source, label = title } = design ?? {}
  if (!job || !source) return { crumbs: design ? [[title, path] as const] : [], here: label }
  const crumbs: Crumb[] = [ALL_JOBS, [job.name || job.id, jobPath(job.id)]]
  if (!('iteration' in source)) return { crumbs, here: `${title} of the best` }
  const { iteration, particle } = source
  crumbs.push(['Iterations', jobPath(job.id, 'iterations')])
  crumbs.push([String(iteration), jobPath(job.id, `iterations/${iteration}`)])
  return { crumbs, here: `${title} of design ${particle}` }
}

interface DesignLinksProps {
  source: DesignSource
  /** Path of the other page; null if it does not apply. */
  path: string | null
  label: string
  withJob?: boolean
}

export function DesignLinks({ source, path, label, withJob = true }: DesignLinksProps) {
  const query = Object.entries(queryOf(source)).map(([name, value]) => [name, value ?? undefined])
  return (
    <div class="row">
      {path !== null && (
        <a class="button" href={withQuery(path, Object.fromEntries(query))}>
          {label}
        </a>
      )}
      {withJob && 'job' in source && (
        <a class="button" href={jobPath(source.job)}>
          Show job
        </a>
      )}
    </div>
  )
}

const RENEW_MS = 4000

function useProgress(initial: StoredJob | undefined): string | null {
  const [renewed, setRenewed] = useState(initial)
  const job = renewed?.id === initial?.id ? renewed : initial
  const active = job !== undefined && isActive(job)
  const renew = (id: string) =>
    // Keep the previous state until a response arrives.
    get('/v1/jobs/{job_id}', { path: { job_id: id } }).then(setRenewed, () => undefined)
  usePolling(() => active && renew(job.id), RENEW_MS, active)
  return active ? progressInWords(job) : null
}
